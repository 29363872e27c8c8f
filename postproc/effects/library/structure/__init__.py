"""Castings, bearings and foundations.

Shape: `link_geometry`, `thermal_growth`. Elastic: `link_compliance`, `bearing_tilt`, `base_compliance`.
"""
