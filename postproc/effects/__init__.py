"""The library of physical effects, one file each, and the contract they share."""
