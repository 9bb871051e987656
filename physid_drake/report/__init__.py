"""Shows results to a person: tables, plots and pages; it reads, it never computes."""
