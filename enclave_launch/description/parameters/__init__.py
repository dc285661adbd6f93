"""Parameters of nodes and components, from what users write to what a node sees."""
