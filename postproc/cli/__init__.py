"""The commands: one thin file each, nothing below imports from here."""
