"""Verification code that shares nothing with the package: numpy and the standard library only."""
