"""One flight: from its order to its end, and what is told of it on the way."""
