"""One arm as its maker describes it: nominal kinematics, inverse kinematics with confdata, limits, link inertias."""
