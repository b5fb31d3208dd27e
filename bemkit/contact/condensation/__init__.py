"""The elastic body of the contact problem: all unknowns but those of the contact nodes are eliminated."""
