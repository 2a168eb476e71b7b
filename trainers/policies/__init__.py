"""Networks and the policies made of them, on disk and off."""
