"""What a packet of rays does at each sample, part by part, for its limit."""
