"""The next measurement: `plan`, by the `design` that tells effects apart, inside the `room` that the user gives."""
