"""From ground forces and swing accelerations to joint torques, in three ways of one signature."""
