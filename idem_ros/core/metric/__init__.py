"""The metric: balls, their moments and entropies, q_tot, Eq. 4 to 9."""
