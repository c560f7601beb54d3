"""The console itself and the machine it runs on."""
