"""Its minimum: the costs, their linearisation, Newton steps."""
