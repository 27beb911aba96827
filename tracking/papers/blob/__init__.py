"""The tracker `blob` (Gonzalez, Rowe, Andrade, Villanueva 2006): people tracked from boxes or from pixels."""
