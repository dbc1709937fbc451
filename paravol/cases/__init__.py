"""Cases: a patient's own scans, made ready to be flown through."""
