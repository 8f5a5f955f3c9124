"""Checks that run the engine against closed forms and published measurements.

A check is a function that builds a scene, runs it and returns a `Measurement`; beside it stand its
`Criterion`s, one for each row of the table. It joins the others by standing in the `CHECKS` of its
file, and a new file by standing in `simcore.validation.registry`.
"""
