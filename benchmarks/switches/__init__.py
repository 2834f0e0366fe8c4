"""Make the set of switches: cases whose answers are known to 30 digits, for any program that finds zeros or events."""
