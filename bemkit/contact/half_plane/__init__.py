"""Half-planes as bodies of the contact problem: strips of their surface, and periodic surfaces."""
