#error "a folder of the consumer stands for one of mbsopt"
