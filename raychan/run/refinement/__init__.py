"""Launches over a scene, refined where detections need it."""
