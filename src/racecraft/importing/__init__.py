"""Files of the original: folders, downloads and archives of others become runs that can be trained."""
