"""Half-planes as contact sees them: strips of their surface, and periodic surfaces."""
