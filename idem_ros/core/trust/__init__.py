"""What is known of a result: observability, covariance, verdict."""
