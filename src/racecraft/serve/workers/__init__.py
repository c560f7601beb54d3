"""Workers that reach the console through its server alone, with a token; see docs/workers.md."""
