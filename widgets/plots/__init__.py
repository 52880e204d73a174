"""The plot of the window, live or still, and what live plots are made of."""
