"""RAPID text from corrected programs, through Jinja templates."""
