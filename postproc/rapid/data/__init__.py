"""RAPID's own data: what a robtarget or tooldata is (`records`), how values are computed with (`values`, `pose`,
`builtins` such as Offs, with predefined data such as v100, z10, tool0), and motion statements with their executions
(`events`), the `arm` that functions ask, the contract with the rooms above.
"""
