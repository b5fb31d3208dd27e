"""The elastic body seen by contact: all unknowns but those of the contact nodes are eliminated."""
