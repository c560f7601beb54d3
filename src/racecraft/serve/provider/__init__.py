"""Sign-in through a school's or company's provider, by OpenID Connect."""
