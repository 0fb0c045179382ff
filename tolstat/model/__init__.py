"""What a machine is to the rest of the house: the contract, and its checks."""
