"""The stand: two parallel crank-rod chains drive the carriage of a cold pilger mill."""
