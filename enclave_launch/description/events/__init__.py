"""Events, their handlers, and the queue between the two."""
