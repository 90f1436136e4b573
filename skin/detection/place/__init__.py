"""Place of a touch: from contact matrices and their noise to a place with a covariance, and whether it is certain."""
