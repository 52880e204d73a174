"""How bytes come from a device: one file a transport, and the thread that reads any of them."""
