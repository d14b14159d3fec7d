"""The parts that every figure uses: cells, measuring, comparison, verdicts and pages."""
