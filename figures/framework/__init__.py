"""What figures are made with: cells, measuring, comparison, verdicts and pages."""
