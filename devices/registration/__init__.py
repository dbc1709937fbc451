"""Where a device stands beside the patient, and how wrong that may be."""
