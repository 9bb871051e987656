"""Makes hidden worlds: draws scenes, pushes, sensors and effects, and simulates them with MuJoCo."""
