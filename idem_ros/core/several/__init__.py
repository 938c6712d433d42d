"""More than two clouds: one joint cloud, one q_tot, one system for all poses."""
