"""World-space radiance cache at the hits of rays."""
