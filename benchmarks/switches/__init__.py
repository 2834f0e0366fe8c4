"""The set of switches: cases with answers of 30 digits for any program that finds zeros or events, and the code that
makes them."""
