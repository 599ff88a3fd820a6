"""What happens to effects: added, edited, copied, removed, brought back."""
