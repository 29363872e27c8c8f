"""Broken inputs: reading them may end in findings, never in a traceback, a hang or half an output."""
