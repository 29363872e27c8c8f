"""Loads that nobody modelled.

Masses: `arm_load`, `payload_error`. Springs: `gravity_compensator`, and hoses, `dress_pack`.
"""
