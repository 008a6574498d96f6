CARGO ?= cargo

.PHONY: header
header: ## write include/gib.h from the Rust sources
	GIB_BLESS=1 $(CARGO) test -q --test header committed_header_is_fresh
