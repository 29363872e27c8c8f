"""The next poses to measure: what they would tell, and whether they would tell two effects apart.

`design` chooses poses one after another, `promise` simulates tables with them and searches these, `plan` is the result.
"""
