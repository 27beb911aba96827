"""The tracker `group-pda` (Gennari & Hager 2004): groups tracked as wholes."""
