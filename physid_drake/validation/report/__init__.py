"""Shows a proof, a run on published recordings and an experiment as tables, pictures and pages."""
