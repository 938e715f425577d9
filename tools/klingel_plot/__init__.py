"""Pictures for klingel: a description in JSON in, a picture out."""
