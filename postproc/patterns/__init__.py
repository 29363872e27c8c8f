"""Patterns of the channels without a physical name: what a residual follows, and where."""
