"""The wizards without a screen: what each wants next, and who or what presses."""
