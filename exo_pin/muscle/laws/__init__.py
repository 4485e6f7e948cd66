"""Force laws of pneumatic muscles, static and dynamic, with the ranges in which they hold."""
