"""Validation: the papers' tables and claims, judged figure by figure."""
