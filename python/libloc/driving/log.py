"""A drive out of an LCM log (placeholder for import order)."""
from __future__ import annotations
def run_of_log():
    ...
