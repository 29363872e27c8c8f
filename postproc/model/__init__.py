"""The arm as it really is: robot plus effects, its elastic equilibrium, stiffness and predicted poses."""
