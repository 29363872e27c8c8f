"""Reads the RAPID language; knows nothing about robots."""
