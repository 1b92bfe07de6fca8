"""Shows what an estimator does, from LCM messages, with the rerun viewer: pictures, space, numbers, status.

Intake decodes messages and counts what it cannot use, Scene draws them into a Recorder, Viewer is the process
that shows it. The program is loc-view.
"""
