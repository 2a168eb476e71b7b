"""What somebody meets who takes hold of the robot: how long it takes to come, and the page in the browser."""
