"""The paper's experiments: repetitions in hidden worlds or on published pushes, and results of numbers."""
