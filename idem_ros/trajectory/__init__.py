"""How far two trajectories are apart."""
