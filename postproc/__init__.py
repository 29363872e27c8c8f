"""Offline post-processor that corrects ABB RAPID programs with a model of the real robot."""

__version__ = "0.1.0"
