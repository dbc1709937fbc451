"""Registration of an arm to a patient, step by step."""
