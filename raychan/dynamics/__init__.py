"""How a ship moves and how it is steered. Pure numpy and scipy; SI and radians; Fossen's symbols and axes.

x forward, y to starboard, z down; heading psi clockwise, roll phi positive with starboard down. `ship.world_pose`
gives the pose in the project's world (y left, z up).
"""
