"""Drawing what is tracked and what is true, on plain ground or over pictures."""
