"""Beyond the paper: table 2 in six degrees of freedom, IDEM and the peers from random starts."""
